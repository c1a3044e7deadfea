var _=(s="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${s}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,ne=`
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
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${ne}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,O=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${O}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ae=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${O}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,N={surface:[_(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),re],item:[_(),oe],placeholder:[_(),ae]};function A(s,e,t=N[e]){let i=s.createProgram(),r=[s.VERTEX_SHADER,s.FRAGMENT_SHADER];if(t.forEach((o,h)=>{let c=s.createShader(r[h]);s.shaderSource(c,o),s.compileShader(c),s.attachShader(i,c),s.deleteShader(c)}),s.linkProgram(i),!s.getProgramParameter(i,s.LINK_STATUS)&&!s.isContextLost())throw new Error(`${e}: ${s.getProgramInfoLog(i)}`);let n={},a=s.isContextLost()?0:s.getProgramParameter(i,s.ACTIVE_UNIFORMS);for(let o=0;o<a;o++){let h=s.getActiveUniform(i,o)?.name??"";n[h]=s.getUniformLocation(i,h)}return{program:i,at:n}}function m(s,e){let t=s.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function C(s,e={},...t){let i=document.createElement(s);for(let[r,n]of Object.entries(e))r in i?Reflect.set(i,r,n):i.setAttribute(r,n);return i.append(...t),i}function P(s){let e=s<1e6?["kB",1e3]:["MB",1e6],t=s/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}var u=class extends Error{constructor(e,t){super(t),this.code=e}};var he=6,ce=.5,I=20,T=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},E=()=>performance.now()/1e3,S=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,i,r="default"){return this.#e(e,r,i,async n=>{let{response:a,body:o}=await this.#s(e,{cache:n},i);if(a.status!==200)throw B(e,a.status);try{return await t(o)}catch(h){if(h instanceof u)throw h;let c=h.message;throw n==="default"?new T(c,!0):new u("PTM-V105",`${L(e)} is damaged: ${c}`)}})}range(e,t,i,r,n,a="default"){let o=`bytes=${t}-${i-1}`;return this.#e(e,a,n,async h=>{let{response:c,body:f}=await this.#s(e,{cache:h,headers:{range:o}},n);if(c.status===200){if(f.length!==r)throw new T(`${f.length} of ${r} bytes`,!0);return this.#t(),{begin:0,body:f}}if(c.status!==206)throw B(e,c.status);let l=c.headers.get("content-range")??`bytes ${t}-${i-1}/${r}`;if(l!==`bytes ${t}-${i-1}/${r}`||f.length!==i-t)throw new T(`${f.length} bytes, "${l}", in place of ${o}`,!0);return{begin:t,body:f}})}#t(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice("Textures load slowly here: the server does not support range requests."))}async#e(e,t,i,r){let n=i?.left??0,a="";for(let o=0;o<he;o++){o&&(i&&Object.assign(i,{left:0,waits:!0}),await fe(ce*2**(o-1))),i&&Object.assign(i,{left:n,waits:!1}),this.pending++;try{return await r(t)}catch(h){if(h instanceof u)throw h;h instanceof T&&h.anew&&(t="no-store"),a=String(h.message)}finally{this.pending--}}throw new u("PTM-V104",`${L(e)} cannot be downloaded: ${a}`)}async#s(e,t,i){this.requests++;let r=new AbortController,n=new T(`nothing came for ${I} s`),a=setTimeout(()=>r.abort(n),1e3*I);try{let o=E(),h=await fetch(e,{...t,signal:r.signal}),c=E(),f=h.body?.getReader(),l=[];for(;;){let{done:w,value:x}=await f?.read()??{done:!0,value:void 0};if(w||!x){let d=le(l);return this.measured?.(o,c,E(),d.length),{response:h,body:d}}clearTimeout(a),a=setTimeout(()=>r.abort(n),1e3*I),l.push(x),this.bytes+=x.length,i&&(i.left-=x.length)}}finally{clearTimeout(a)}}};function le(s){let e=new Uint8Array(s.reduce((i,{length:r})=>i+r,0)),t=0;for(let i of s)e.set(i,t),t+=i.length;return e}function B(s,e){if(e>=500||e===429||e===408)return new T(`status ${e}`);let t=e===404?"is missing":`is refused with status ${e}`;return new u("PTM-V103",`${L(s)} ${t} on this site`)}function L(s){return decodeURIComponent(new URL(s,location.href).pathname.split("/").pop()??s)}function fe(s){return new Promise(e=>{let t=()=>{clearTimeout(i),removeEventListener("online",t),e(void 0)},i=setTimeout(t,1e3*s);addEventListener("online",t)})}var X="Tell the owner of this site: publishing it again should repair it.",z="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",de={"PTM-V101":`${z}, with hardware acceleration on.`,"PTM-V102":`${z}.`,"PTM-V103":X,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":X},ue="Reload the page. If that does not help, tell the owner of this site.",G=8e3,me=["nav","#panels","#view"];function V(s,{code:e,message:t}){let i=m(s,"#error"),r=m(s,"#again");m(s,"#error-text").textContent=t,m(s,"#error-remedy").textContent=de[e]??ue,m(s,"#error-code").textContent=e,m(s,"#loading").hidden=!0,i.hidden=!1;for(let n of me)m(s,n).inert=!0;r.onclick=()=>location.reload(),r.focus()}function k(s,...e){let t=C("p",{},...e);m(s,"#notices").append(t);let i=()=>{t.contains(s.activeElement)?setTimeout(i,G):t.remove()};setTimeout(i,G)}var pe=15,we=5;async function j(s){let e=!1,t=!1,i=r=>{e=!0;let n=r instanceof u;V(document,n?r:new u("PTM-V107",String(r)))};try{let r=m(document,"canvas"),n=JSON.parse(m(document,"#site").textContent??""),a=r.getContext("webgl2",{antialias:!0,preserveDrawingBuffer:!1});if(!a)throw new u("PTM-V101","This browser cannot draw with WebGL 2.");let o=null,h=E();r.addEventListener("webglcontextlost",d=>{d.preventDefault(),t=!0;let g=()=>i(new u("PTM-V107","The graphics card has reset the page."));E()-h<we?g():setTimeout(g,1e3*pe)}),r.addEventListener("webglcontextrestored",()=>{e||(o?.address&&history.replaceState(null,"",o.address()),location.reload())});let c=new S(d=>k(document,d));o=await s(a,n,c,d=>{t||i(d)});let f=o;Object.assign(window,{ptm:o});let l=m(document,"#status"),w=E(),x=()=>{if(e||t)return;let d=E();try{xe(r);let g=f.frame(Math.min(d-w,.1));l.textContent!==g&&(l.textContent=g)}catch(g){throw i(g),g}w=d,requestAnimationFrame(x)};requestAnimationFrame(x),document.body.classList.add("begun")}catch(r){i(r)}}function xe(s){let e=Math.max(1,Math.round(s.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(s.clientHeight*devicePixelRatio));(s.width!==e||s.height!==t)&&Object.assign(s,{width:e,height:t})}function W(s,e,t){return s.whole(e,i=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(i))))}var ge=Uint32Array.from({length:256},(s,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function D(s,e=0){let t=~e;for(let i=0;i<s.length;i++)t=ge[(t^s[i])&255]^t>>>8;return~t>>>0}var je=2**24;var We=new Uint8Array([3,0]);function p(s,e){if(!s)throw new Error(e)}var R=(s,e,t)=>Number.isInteger(s)&&e<=s&&s<=t;var H={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},Ee=65536,Te=2**30;function K(s){p(s?.format==="ptmtools interlaced image"&&s.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:i,files:r,kind:n,original:a}=s,o=c=>R(c,1,Ee);p(o(e)&&o(t)&&o(a?.width)&&o(a?.height),"no size"),p(i in H&&(n==="uint8"||n==="uint16"),"another container"),p(Array.isArray(r)&&R(r.length,1,33),"no files");let h={width:0,height:0};return r.forEach((c,f)=>{let{axis:l,joined:w}=c;p(c.name===`${f+1}.${i}`,"a file of another name"),p(o(c.width)&&o(c.height),"a file without size"),p(R(c.bytes,1,9*c.width*c.height+2**20),"a file of too many bytes"),p(R(c.crc32,0,4294967295)&&(f?l==="columns"||l==="rows":l===null),"no axis");let[x,d]=f?l==="columns"?[2,1]:[1,2]:[1,1];f||(h={width:c.width,height:c.height}),p(c.width===h.width&&c.height===h.height,"a file of another size"),h={width:x*h.width,height:d*h.height},p(w?.width===h.width&&w?.height===h.height,"a step of another size")}),p(h.width===e&&h.height===t,"steps that do not make the image"),s}var ve=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,ye=`#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before,next,pattern;
uniform vec2 size;
out vec4 texel;
void main(){
vec2 place=gl_FragCoord.xy/size;
texel=texture(pattern,place*size/2.0).r==0.0?texture(before,place):texture(next,place);
}`,Re={columns:[0,255,0,255],rows:[0,0,255,255]};async function be(s,e){if(!e)return createImageBitmap(s,{colorSpaceConversion:"none"});let t=URL.createObjectURL(s),i=Object.assign(new Image,{src:t});return await i.decode().finally(()=>URL.revokeObjectURL(t)),i}var M=class{constructor(e,t,i,r){this.gl=e,this.index=t,this.urlOf=i,this.fetcher=r,this.use=A(e,"join",[ve,ye]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(Re).map(([o,h])=>{let c=this.#s(2,2,e.R8,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(h)),[o,c]})),this.texture=null,this.steps=0,this.running=!1;let n=e.getParameter(e.MAX_TEXTURE_SIZE),a=t.files.findIndex(({joined:{width:o,height:h}})=>Math.max(o,h)>n||4*o*h>Te);if(this.most=a<0?t.files.length:a,!this.most)throw new u("PTM-V101","The image is larger than this graphics card's textures.")}get size(){return this.steps?this.index.files[this.steps-1].joined:{width:0,height:0}}advance(e){this.running||this.steps===this.most||(this.running=!0,this.#t().then(()=>this.running=!1,e))}async#t(){let{gl:e}=this,t=this.index.files[this.steps],i=await this.fetcher.whole(this.urlOf(t.name),async n=>{p(n.length===t.bytes&&D(n)===t.crc32,"another checksum");let a=new Blob([n],{type:H[this.index.container]}),o=await be(a,this.index.components%2===0);return p(o.width===t.width&&o.height===t.height,"an image of another size"),o}),r=this.#s(t.width,t.height,e.RGBA8,e.CLAMP_TO_EDGE);if(e.pixelStorei(e.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),e.pixelStorei(e.UNPACK_COLORSPACE_CONVERSION_WEBGL,e.NONE),e.texSubImage2D(e.TEXTURE_2D,0,0,0,e.RGBA,e.UNSIGNED_BYTE,i),"close"in i&&i.close(),t.axis){let n=this.#e(t,r);e.deleteTexture(this.texture),e.deleteTexture(r),this.texture=n}else this.texture=r;this.steps++}#e({axis:e,joined:{width:t,height:i}},r){let{gl:n,use:{program:a,at:o}}=this,h=this.#s(t,i,n.RGBA8,n.CLAMP_TO_EDGE);n.bindFramebuffer(n.FRAMEBUFFER,this.buffer),n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,h,0),n.viewport(0,0,t,i),n.disable(n.BLEND),n.useProgram(a);let c={before:this.texture,next:r,pattern:this.patterns[e]};return Object.entries(c).forEach(([f,l],w)=>{n.activeTexture(n.TEXTURE0+w),n.bindTexture(n.TEXTURE_2D,l),n.uniform1i(o[f],w)}),n.uniform2f(o.size,t,i),n.drawArrays(n.TRIANGLES,0,3),n.bindFramebuffer(n.FRAMEBUFFER,null),h}texels(){let{gl:e}=this,{width:t,height:i}=this.size,r=new Uint8Array(4*t*i);return e.bindFramebuffer(e.FRAMEBUFFER,this.buffer),e.framebufferTexture2D(e.FRAMEBUFFER,e.COLOR_ATTACHMENT0,e.TEXTURE_2D,this.texture,0),e.readPixels(0,0,t,i,e.RGBA,e.UNSIGNED_BYTE,r),e.bindFramebuffer(e.FRAMEBUFFER,null),r}#s(e,t,i,r){let{gl:n}=this,a=n.createTexture();n.bindTexture(n.TEXTURE_2D,a),n.texStorage2D(n.TEXTURE_2D,1,i,e,t);for(let o of[n.TEXTURE_MIN_FILTER,n.TEXTURE_MAG_FILTER])n.texParameteri(n.TEXTURE_2D,o,n.NEAREST);for(let o of[n.TEXTURE_WRAP_S,n.TEXTURE_WRAP_T])n.texParameteri(n.TEXTURE_2D,o,r);return a}};var Y={ArrowLeft:[1,0,0],ArrowRight:[-1,0,0],ArrowUp:[0,1,0],ArrowDown:[0,-1,0],Equal:[0,0,1],NumpadAdd:[0,0,1],Minus:[0,0,-1],NumpadSubtract:[0,0,-1]},U=class{#t=new Set;#e=new Map;constructor(e,t,i){this.canvas=e,this.width=t,this.height=i,this.scale=0,this.shift=[0,0],e.focus({preventScroll:!0}),e.addEventListener("pointerdown",r=>{r.button===0&&(e.setPointerCapture(r.pointerId),this.#e.set(r.pointerId,this.#n(r)))});for(let r of["pointerup","pointercancel"])e.addEventListener(r,n=>this.#e.delete(n.pointerId));e.addEventListener("pointermove",r=>this.#a(r)),e.addEventListener("wheel",r=>{r.preventDefault(),this.#i(Math.exp(-r.deltaY*.0015),this.#n(r))},{passive:!1}),e.addEventListener("keydown",r=>{if(r.ctrlKey||r.metaKey||r.altKey)return this.#t.clear();r.code in Y&&(r.preventDefault(),this.#t.add(r.code))}),e.addEventListener("keyup",r=>this.#t.delete(r.code)),e.addEventListener("blur",()=>this.#t.clear())}get#s(){return Math.min(this.canvas.width/this.width,this.canvas.height/this.height)}get pixels(){return this.scale||this.#s}place(e,t=[0,0]){this.scale=e>0?this.#r(e):0;let i=[this.width,this.height].map(n=>n*this.pixels),r=[this.canvas.width,this.canvas.height];this.shift=t.map((n,a)=>Math.max(-1,Math.min(1,2*n/(i[a]+.8*r[a])))*(i[a]+.8*r[a])/2)}step(e){for(let t of this.#t){let[i,r,n]=Y[t];n?this.#i(Math.exp(n*1.2*e),[0,0]):this.place(this.scale,[this.shift[0]+i*600*e,this.shift[1]+r*600*e])}}get box(){let{width:e,height:t}=this.canvas,{pixels:i,shift:[r,n]}=this,[a,o]=[this.width*i/e,this.height*i/t],[h,c]=[2*r/e,2*n/t];return[h-a,-c-o,h+a,-c+o]}#r(e){let t=this.#s;return Math.max(.25*Math.min(1,t),Math.min(Math.max(32,2*t),e))}#i(e,t){let i=this.pixels,r=this.#r(i*e);this.place(r,this.shift.map((n,a)=>t[a]+(n-t[a])*(r/i)))}#n({offsetX:e,offsetY:t}){let i=this.canvas.width/Math.max(1,this.canvas.clientWidth);return[e*i-this.canvas.width/2,t*i-this.canvas.height/2]}#a(e){if(!this.#e.get(e.pointerId))return;let{spread:i,middle:r}=this.#o();this.#e.set(e.pointerId,this.#n(e));let n=this.#o();this.place(this.scale,this.shift.map((a,o)=>a+n.middle[o]-r[o])),i>0&&n.spread>0&&this.#i(n.spread/i,n.middle)}#o(){let e=[...this.#e.values()],[t,i]=e;return{middle:[0,1].map(n=>e.reduce((a,o)=>a+o[n],0)/e.length),spread:i?Math.hypot(t[0]-i[0],t[1]-i[1]):0}}};var Ae=`#version 300 es
uniform vec4 box;
out vec2 place;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1);
place=vec2(corner.x,1.0-corner.y);
gl_Position=vec4(mix(box.xy,box.zw,corner),0,1);
}`,Se=`#version 300 es
precision highp float;
uniform sampler2D image;
in vec2 place;
out vec4 shown;
void main(){
vec2 size=vec2(textureSize(image,0));
vec2 step=vec2(dFdx(place.x),dFdy(place.y));
vec2 each=clamp(ceil(abs(step)*size),1.0,8.0);
vec4 sum=vec4(0);
for(float y=0.5; y < each.y; y++)
for(float x=0.5; x < each.x; x++){
vec4 texel=texture(image,place+(vec2(x,y)/each-0.5)*step);
sum+=vec4(texel.rgb*texel.a,texel.a);
}
sum/=each.x*each.y;
shown=vec4(sum.rgb+(1.0-sum.a)*vec3(0.227,0.243,0.275),1);
}`;j(async(s,e,t,i)=>{let r=new URL(e.index,location.href).href,n=y=>new URL(y,r).href,a=await W(t,r,K),o=new M(s,a,n,t),{width:h,height:c}=a.original,f=s.canvas,l=new U(f,h,c),w=new URLSearchParams(location.search).has("all"),{program:x,at:d}=A(s,"picture",[Ae,Se]),g=s.createVertexArray(),q=a.files.reduce((y,{bytes:v})=>y+v,0);m(document,"#keys").textContent="Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom";let b=!0,F="",J=()=>{s.viewport(0,0,s.drawingBufferWidth,s.drawingBufferHeight),s.clearColor(.086,.09,.106,1),s.clear(s.COLOR_BUFFER_BIT),o.texture&&(s.useProgram(x),s.bindVertexArray(g),s.activeTexture(s.TEXTURE0),s.bindTexture(s.TEXTURE_2D,o.texture),s.uniform1i(d.image,0),s.uniform4fv(d.box,l.box),s.drawArrays(s.TRIANGLE_STRIP,0,4))};return{frame(y){l.step(y);let{size:v}=o;b=w||!o.steps||v.width<l.pixels*h||v.height<l.pixels*c,b&&o.advance(i);let $=[f.width,f.height,...l.box,o.steps].join();$!==F&&J(),F=$;let Z=a.files.slice(0,o.steps).reduce((se,{bytes:ie})=>se+ie,0),Q=o.steps===a.files.length?"":o.steps===o.most?"; more than this graphics card can hold":b?" …":"; finer ones when you zoom in",ee=`${o.steps} of ${a.files.length} files, ${v.width} × ${v.height} of ${a.width} × ${a.height}`,te=a.kind==="uint16"?"; shown in 8 bits":"";return`${ee}, ${P(Z)} of ${P(q)}${Q}${te}`},state:()=>({steps:o.steps,size:o.size,complete:o.steps===o.most,needed:b,pending:t.pending,requests:t.requests,bytes:t.bytes}),texels:()=>o.texels(),place:l.place.bind(l)}});
