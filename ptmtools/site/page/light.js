var b=[1,1,1],S=`
vec3 linear(vec3 color){
vec3 curve=color*(color*(color*(color*-0.11677+0.52647)+0.5604)+0.0284)+0.00105;
return mix(curve,color/12.92,lessThanEqual(color,vec3(0.04045)));
}`,E={plain:"",neutral:`
float most=max(light.r,max(light.g,light.b));
if(most > 0.8){
float peak=1.0-0.04/(most-0.6);
light=mix(light*(peak/most),vec3(peak),1.0-1.0/(0.15*(most-peak)+1.0));
}`,agx:`
light*=mat3(0.544815,0.373787,0.081384,0.140417,0.754152,0.105431,0.088811,0.178876,0.732313);
vec3 y=clamp(log2(max(light,1e-9))/16.5+0.755995,0.0,1.0);
light=(((((15.5*y-40.14)*y+31.96)*y-6.868)*y+0.4298)*y+0.1191)*y-0.00232;
light*=mat3(1.127101,-0.110607,-0.016494,-0.14133,1.157824,-0.016494,-0.14133,-0.110607,1.251936);
light=pow(max(light,0.0),vec3(2.2));
light*=mat3(1.660491,-0.587641,-0.07285,-0.12455,1.1329,-0.008349,-0.018151,-0.100579,1.11873);`},T=s=>`
vec3 developed(vec3 light){${E[s]??E.neutral}
light=clamp(light,0.0,1.0);
vec3 root=sqrt(light),curve=0.29812*sqrt(root)+0.83374*root-0.05531*light-0.07691;
return mix(curve,12.92*light,lessThanEqual(light,vec3(0.0031308)));
}`,N=s=>`
layout(location=3)in vec2 place2;
out vec2 spot;
uniform float white;${s?`
layout(location = 5) in vec3 normal;
out vec3 bent;
out vec3 away;`:""}
void main() {
  spot = place2;${s?`
  bent = normal;
  away = position - eye;`:""}`,U=`
in vec3 bent;
in vec3 away;
uniform vec3 eye;
uniform vec3 centre;
uniform vec3 low;
uniform vec3 high;
uniform vec2 polish;
uniform vec2 power;
uniform sampler2D probe;
uniform vec3 haze;
vec3 way;
vec2 part;
vec3 stored(vec2 place,float level){
vec2 corner=vec2(level < 1.0?0.0:level < 3.0?128.0:160.0,level < 2.0?0.0:64.0);
return textureLod(probe,(corner+1.0+place*(exp2(7.0-level)-2.0))/vec2(192.0,128.0),0.0).rgb;
}
vec3 seenAlong(vec3 ray,float rough){
vec3 share=haze;
if(share.r < 0.0){
ray/=abs(ray.x)+abs(ray.y)+abs(ray.z);
vec2 place=ray.xz;
if(ray.y < 0.0)place=(1.0-abs(ray.zx))*mix(vec2(-1.0),vec2(1.0),greaterThanEqual(place,vec2(0.0)));
float level=min(floor(3.0*rough),2.0);
place=place*0.5+0.5;
share=mix(stored(place,level),stored(place,level+1.0),3.0*rough-level);
}
return power.x*exp2(stops*(share-1.0));
}
void meet(){
vec3 normal=dot(bent,bent)> 0.0?bent:cross(dFdx(away),dFdy(away));
vec3 ray=normalize(away);
normal*=inversesqrt(max(dot(normal,normal),1e-36));
way=reflect(ray,normal);
vec3 at=eye+away,ends=max((high-at)/way,(low-at)/way);
way=at+way*max(0.0,min(ends.x,min(ends.y,ends.z)))-centre;
vec4 k=polish.y*vec4(-1.0,-0.0275,-0.572,0.022)+vec4(1.0,0.0425,1.04,-0.04);
float share=min(k.x*k.x,exp2(-9.28*max(abs(dot(normal,ray)),0.001)))*k.x+k.y;
part=vec2(-1.04,1.04)*share+k.zw;
}
vec3 reflected(vec3 base,vec3 light){
meet();
vec3 share=mix(vec3(0.04),base,polish.x)*part.x+part.y,image=seenAlong(way,polish.y);
image*=mix(1.0,min(1.0,dot(light,vec3(0.2126,0.7152,0.0722))/power.y),polish.y);
image=mix(image,light,smoothstep(0.2,0.8,polish.y))*share;
return base*light*(1.0-polish.x)*(1.0-max(share.r,max(share.g,share.b)))+image;
}`,$=`
if(white==0.0){
meet();
float share=0.04*part.x+part.y;
share*=1.9-0.9*share;
vec3 behind=seenAlong(away,1.0)*exposure;
vec3 image=developed(behind*(1.0-share)+seenAlong(way,polish.y)*share*exposure);
shown.rgb*=shown.a*(1.0-share);
shown.rgb+=max(image-(1.0-share)*developed(behind),0.0);
shown.a+=share*(1.0-shown.a);
}
`,z=({stops:s,hue:e=1,tone:t},o)=>`
const float stops=float(${s});
in vec2 spot;
uniform float white;
uniform vec3 exposure;
uniform sampler2D lightmap;
uniform vec3 code;
${S}
${T(t)}
${o?U:""}
vec3 display(vec3 texel){
if(white==0.0)return texel*color.rgb*painted;
vec3 share=code.r < 0.0?texture(lightmap,spot).rgb:code;
share=mix(vec3(dot(share,vec3(0.299,0.587,0.114))),share,1.0/float(${Math.max(1,e)||1}));
${o?"  return developed(exposure*reflected(linear(texel)*color.rgb*painted,white*exp2(stops*(share-1.0))));":"  return developed(linear(texel)*color.rgb*painted*white*exposure*exp2(stops*(share-1.0)));"}
}
void main`,I=`#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec4 lens;
out vec3 way;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1)*4.0-1.0;
way=inverse(turn)*vec3(corner/lens.xy,-1.0);
gl_Position=vec4(corner,1.0,1.0);
}`,M=s=>`#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${T(s)}
void main(){
shown=vec4(developed(mix(ground,sky,smoothstep(-0.02,0.02,normalize(way).y))),1.0);
}`,x=class{exposure=b;#r=[];#t=0;#e=!0;#a=null;#i=null;#o=new WeakMap;constructor(e,t){this.row=e,this.probes=t.map(({probe:o})=>{let{white:r,mean:l,centre:p,low:u,high:c}=o??{};return[r,l,...[p,u,c].flat()].every(Number.isFinite)?o:void 0})}sources([e,t],o=!1){if(!t.includes("painted"))return[e,t];let r=t.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/,"display(sampled.rgb)");return[e.replace(/void main\(\) ?{/,N(o)).replace(/painted ?= ?paint\.rgb/,"painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),r.replace("void main",z(this.row,o)).replace(/if ?\(shown\.a/,`${o?$:""}$&`).replace(/glow ?= ?0\.25/,"glow = white > 0.0 ? 1.0 : 0.7")]}illuminate(e){e.light=this,e.gl.deleteProgram(e.surface.program),e.surface=e.compile("surface")}adapt({cell:e,client:{known:t},index:{cells:o},memory:{fades:r},picture:l},p,u){let{exposure:c,row:{tone:m}}=this,h=e<0||m==="plain"?c:o[e].exposure??b;this.#e||=!(Math.hypot(...p.map((a,i)=>a-this.#r[i]))<1);let v=this.#e||!r?0:Math.exp((this.#t-u)/.2),n=h.map((a,i)=>(c[i]/a)**v),f=n.some(a=>Math.abs(Math.log(a))>.01);this.exposure=f?h.map((a,i)=>a*n[i]):h,this.#e&&=!t[e],this.#t=u,this.#r=[...p],this.exposure!==c&&l.touch()}mirrorOf(e,{probe:t}){return!this.probes[t]||this.row.tone==="plain"?null:this.#i??=e.compile("mirror",void 0,!0)}paint({gl:e,memory:t,means:o},r,l,p){let{white:u,light:c,probe:m,extras:h}=l,{exposure:v,probes:{[m]:n}}=this;e.uniform1f(r.white,u),e.uniform3fv(r.exposure,v);let f=(a,i,g,A,y)=>{let d=a<0?null:t.of(a),w=d&&d.levels>=i;if(e.uniform3fv(r[g],w?[-1,-1,-1]:o[a]??[1,1,1]),!w)return!1;e.activeTexture(e.TEXTURE0+y);let k=d.bind(!0,!0,i?1/0:p,!0);return i&&e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MIN_FILTER,e.LINEAR),e.activeTexture(e.TEXTURE0),e.uniform1i(r[A],y),k};if(n&&r.polish){let a=this.#o.get(l);if(!a){let{metallicFactor:i=0,roughnessFactor:g=1}=JSON.parse(h);this.#o.set(l,a=[i,g])}e.uniform2fv(r.polish,a),e.uniform2f(r.power,n.white,Math.max(n.mean,1e-30));for(let i of["centre","low","high"])e.uniform3fv(r[i],n[i]);f(m,t.rows[m].sizes.length,"haze","probe",3)}return f(c,0,"code","lightmap",1)}surround(e,{turn:t,lens:o}){let{gl:r}=e,{row:{tone:l,sky:p=[],ground:u=[]},exposure:c}=this;if(l==="plain")return;let{program:m,at:h}=this.#a??=e.compile("surroundings",[I,M(l)]);r.useProgram(m),r.uniformMatrix3fv(h.turn,!1,t),r.uniform4fv(h.lens,o),r.uniform3fv(h.sky,p.map((v,n)=>v*c[n])),r.uniform3fv(h.ground,u.map((v,n)=>v*c[n])),r.bindVertexArray(null),r.depthFunc(r.LEQUAL),r.drawArrays(r.TRIANGLES,0,3),r.depthFunc(r.LESS)}};function L({comparison:s,index:e,picture:{renderer:t}}){if(!e.light)return;let o=new x(e.light,e.textures);o.illuminate(t),s&&o.illuminate(s.renderer)}export{x as Light,L as show};
