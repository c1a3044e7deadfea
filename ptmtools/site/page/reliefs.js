var G=()=>import("./statues.js");function F({texture:r,factor:e,blends:o,cutoff:t,twoSided:a,extras:n}){return[r,e,o,t,a,n].join()}var H=(r,e)=>e?r**.25:te(r);function te(r){return r<=.0031308?12.92*r:1.055*r**(1/2.4)-.055}function W(r,{program:e,at:o},t){r.useProgram(e),r.uniform3fv(o.eye,t.eye),r.uniformMatrix3fv(o.turn,!1,t.turn),r.uniform4fv(o.lens,t.lens)}var A=(r="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,C=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${C}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,$=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${$}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ne=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${$}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,j=[A(),oe],we=[A(),re],ve=[A(),ne];var k=class extends Error{constructor(e,o){super(o),this.code=e}};var se=[.5,.7,.6].map(r=>r/Math.hypot(.5,.7,.6)),D=`
float lit(vec3 normal){
float along=(1.0+dot(normal,vec3(${se.join()})))/2.0;
return ${.3}+${1-.3}*along*along;
}`;function Y(r,e,o,t=0,a=t){let n=0;for(let s=0;s<3;s++){let i=Math.max(e[t+s]-r[s],r[s]-o[a+s],0);n+=i*i}return Math.sqrt(n)}function X(r,e){let{T:o,K:t,gains:a,previews:{first:n}}=r;if(!q.has(a)){q.add(a);for(let s=0;s<o;s++)if(e[s].normals)for(let[i,c]of[[s,s+1],[o+n[s],o+n[s+1]]])for(let f=i*t;f<c*t;f++)a[f]*=.25}}var q=new WeakSet;var ie=(r,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[r]);var P=ie("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var Le=Promise.resolve();var K=(r,e)=>r.replace(/\{(\w+)\}/g,(o,t)=>e[t]);var J=[2,3,4],N=33071,ce={normalWrapS:N,normalWrapT:N},le=.1,fe=A(`
layout(location=4)in vec2 second;
layout(location=5)in vec3 up;
layout(location=6)in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),ue=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${C}
${D}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,de=D.replace("lit","lamplight"),he=[A(`
layout(location = 4) in vec2 second;
out vec2 at;`,"at = second;"),j[1].replace("out vec4 shown;",`out vec4 shown;
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${de}`).replace(/shown ?= ?vec4/,`
vec3 a=dFdx(seen),b=dFdy(seen);
vec2 p=dFdx(at),q=dFdy(at);
float side=sign(p.x*q.y-p.y*q.x);
vec3 up=normalize(cross(a,b)),right=(a*q.y-b*p.y)*side,over=(a*q.x-b*p.x)*side;
if(dot(right,right)> 0.0){
vec3 tilt=texture(relief,at).rgb*2.0-1.0;
right=normalize(right);
vec3 across=cross(up,right);
if(dot(across,over)< 0.0)across=-across;
vec3 normal=scale*(right*tilt.x+across*tilt.y)+up*tilt.z;
light*=lamplight(normalize(normal)*turn)/lamplight(up*turn);
}
$&`)],L=class{#e=new Map;#i=new WeakMap;#c=new WeakMap;#o=new WeakSet;#r=!1;constructor(e){let{gl:o,picture:{renderer:t}}=e;this.gl=o,this.walk=e,this.program=t.compile("relief",[fe,ue]),this.bumps=t.compile("bumps",he),X(e.client.catalogue,e.index.textures)}delete(){for(let e of this.#e.keys())this.#a(e)}has(e){return this.walk.memory.held[e.relief]>0&&this.#n(e)}#n(e){let{relief:o,frames:t,positions:a}=e;if(o<0||this.#o.has(e))return!1;let n=a.length/3,s=t?.every((f,u)=>f.length===J[u]*n),i=M(e)?1:J.length,c=this.walk.index.textures[o];return s&&t?.length===i&&c&&(i===1||c.relief!==void 0)?!0:(this.#o.add(e),this.walk.report(new k("PTM-V105",K(P.relief,{name:e.name||P.object}))),!1)}get lacks(){return!this.#r}get levels(){let{index:{textures:e},memory:{held:o}}=this.walk;return e.flatMap(({relief:t,normals:a},n)=>a||t!==void 0?[o[n]]:[])}advance(e,o,t){this.#l();let{gl:a,walk:{client:n,client:{catalogue:{K:s,levels:i}},needs:{present:c}}}=this;if(!c)return;let f=a.drawingBufferWidth*a.drawingBufferHeight,u=!1,m=new Map;for(let{batches:l}of e)for(let{look:d,low:g,high:x}of l){let{relief:h,blends:y,texture:p}=d;if(y||!this.#n(d))continue;if(M(d)&&p>=0){let T=Math.log2(this.#t(d)/this.#t(d,p)),E=`${h} ${p}`,O=m.get(E)??new Float64Array(s);m.set(E,O);for(let R=1;R<=i[h];R++){let B=Math.max(1,i[p]-i[h]+R+T),_=Math.floor(B),[V,ee]=[_,_+1].map(z=>z<s?c[p*s+z]:0);O[R]=Math.max(O[R],V+(B-_)*(ee-V))}continue}let v=t/2/Math.max(le,Y(o,g,x)),[b,S,I]=g.map((T,E)=>x[E]-T),U=Math.min(1,v*v*S*Math.max(b,I)/f),Q=Math.max(0,Math.floor(Math.log2(this.#t(d)/v)));for(let T=1,E=h*s+1;T<=Math.max(1,i[h]-Q);T++,E++)c[E]>=U||(c[E]=U,u=!0)}let w=new Map;for(let[l,d]of m){let g=parseInt(l)*s;d.forEach((x,h)=>w.set(g+h,(w.get(g+h)??0)+x))}for(let[l,d]of w)c[l]>=d||(c[l]=d,u=!0);u&&n.sees(c,n.hidden),this.#r=!0}#l(){if(!this.#e.size)return;let{cells:e}=this.walk.picture.renderer,o=new Set([...e.values()].flatMap(({shapes:t})=>t));for(let t of this.#e.keys())o.has(t)||this.#a(t)}#t(e,o){let t=o===void 0?this.#i:this.#c,a=t.get(e);if(a)return a;let{positions:n,indices:s,relief:i,frames:c,uvs:f}=e,u=o===void 0?c?.[0]:f,{width:m,height:w}=this.walk.index.textures[o??i],l=0,d=0;for(let x=0;x<s.length;x+=3){let[h,y,p]=s.subarray(x,x+3);l+=Z(n,3,h,y,p),d+=Z(u,2,h,y,p)}let g=l*d>0?Math.sqrt(d*m*w/l):1;return t.set(e,g),g}draw(e,o,t,a){let{gl:n,walk:s}=this;for(let f of[this.program,this.bumps])W(n,f,e),n.uniform1i(f.at.relief,2);let i=!1,c=new Set;for(let{buffers:f,batch:u}of o){if(c.has(u.look))continue;c.add(u.look);let{relief:m,extras:w}=u.look,l=M(u.look),{normalScale:d=1,normalWrapS:g,normalWrapT:x}=l?JSON.parse(w):ce,h=g===N,y=x===N,p=l?this.bumps:this.program;n.useProgram(p.program),n.uniform1f(p.at.scale,d),n.activeTexture(n.TEXTURE2),i=s.memory.of(m)?.bind(h,y,a)||i,n.activeTexture(n.TEXTURE0),i=t(p.at,u)||i;let v=F(u.look);for(let b of f.shapes){if(F(b)!==v)continue;let{array:S,count:I}=this.#f(b);n.bindVertexArray(S),n.drawElements(n.TRIANGLES,I,n.UNSIGNED_INT,0)}}return i}#f(e){let o=this.#e.get(e);if(o)return o;let{gl:t}=this,{positions:a,uvs:n,colors:s,indices:i,frames:c,spots:f,white:u}=e,m=t.createVertexArray(),w=i.length;t.bindVertexArray(m);let l=[],[d,g,x=null]=c,h=s&&Float32Array.from(s,v=>H(v/65535,u)),y=[[0,a,3],[1,n,2],[2,h,4],[3,f,2],[4,d,2]];M(e)||y.push([5,g,3],[6,x,4]);for(let[v,b,S]of y)b&&(l.push(this.#s(t.ARRAY_BUFFER,b)),t.enableVertexAttribArray(v),t.vertexAttribPointer(v,S,t.FLOAT,!1,0,0));t.vertexAttrib4f(2,1,1,1,1),l.push(this.#s(t.ELEMENT_ARRAY_BUFFER,Uint32Array.from(i))),t.bindVertexArray(null);let p={array:m,buffers:l,count:w};return this.#e.set(e,p),p}#s(e,o){let{gl:t}=this,a=t.createBuffer();return t.bindBuffer(e,a),t.bufferData(e,o,t.STATIC_DRAW),a}#a(e){let o=this.#e.get(e);if(o){this.gl.deleteVertexArray(o.array);for(let t of o.buffers)this.gl.deleteBuffer(t);this.#e.delete(e)}}},M=({extras:r})=>r.includes("normalCoords");function Z(r,e,o,t,a){let n=w=>[0,1,2].map(l=>l<e?r[e*w+l]-r[e*o+l]:0),[s,i,c]=n(t),[f,u,m]=n(a);return Math.hypot(i*m-c*u,c*f-s*m,s*u-i*f)}async function We(r){r.index.octrees&&(await G()).show(r);let{picture:{renderer:e}}=r,o=new L(r),{statues:t}=e;e.statues=t?pe(t,o):o}function pe(r,e){return{delete(){r.delete(),e.delete()},has:o=>r.has(o)||e.has(o),get lacks(){return r.lacks||e.lacks},get levels(){return r.levels},get bytes(){return r.bytes},advance(o,t,a,n){r.advance(o,t,a,n),e.advance(o,t,a)},draw(o,t,a,n){let s=({batch:c})=>r.has(c.look),i=r.draw(o,t.filter(s),a,n);return e.draw(o,t.filter(c=>!s(c)),a,n)||i}}}export{We as show};
