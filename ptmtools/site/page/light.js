var A=`
vec3 linear(vec3 color){
vec3 curve=color*(color*(color*(color*-0.11677+0.52647)+0.5604)+0.0284)+0.00105;
return mix(curve,color/12.92,lessThanEqual(color,vec3(0.04045)));
}`,b={plain:"",neutral:`
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
light*=mat3(1.660491,-0.587641,-0.07285,-0.12455,1.1329,-0.008349,-0.018151,-0.100579,1.11873);`},E=a=>`
vec3 developed(vec3 light){${b[a]??b.neutral}
light=clamp(light,0.0,1.0);
vec3 root=sqrt(light),curve=0.29812*sqrt(root)+0.83374*root-0.05531*light-0.07691;
return mix(curve,12.92*light,lessThanEqual(light,vec3(0.0031308)));
}`,N=a=>`
layout(location=3)in vec2 place2;
out vec2 spot;
uniform float white;${a?`
layout(location = 5) in vec3 normal;
out vec3 bent;
out vec3 away;`:""}
void main() {
  spot = place2;${a?`
  bent = normal;
  away = position - eye;`:""}`,S=`
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
}`,z=`
if(white==0.0){
meet();
float share=0.04*part.x+part.y;
share*=1.9-0.9*share;
vec3 behind=seenAlong(away,1.0),image=developed(behind*(1.0-share)+seenAlong(way,polish.y)*share);
shown.rgb*=shown.a*(1.0-share);
shown.rgb+=max(image-(1.0-share)*developed(behind),0.0);
shown.a+=share*(1.0-shown.a);
}
`,I=({stops:a,tone:e},r)=>`
const float stops=float(${a});
in vec2 spot;
uniform float white;
uniform sampler2D lightmap;
uniform vec3 code;
${A}
${E(e)}
${r?S:""}
vec3 display(vec3 texel){
if(white==0.0)return texel*color.rgb*painted;
vec3 share=code.r < 0.0?texture(lightmap,spot).rgb:code;
${r?"  return developed(reflected(linear(texel)*color.rgb*painted,white*exp2(stops*(share-1.0))));":"  return developed(linear(texel)*color.rgb*painted*white*exp2(stops*(share-1.0)));"}
}
void main`,$=`#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec4 lens;
out vec3 way;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1)*4.0-1.0;
way=inverse(turn)*vec3(corner/lens.xy,-1.0);
gl_Position=vec4(corner,1.0,1.0);
}`,M=a=>`#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${E(a)}
void main(){
shown=vec4(developed(mix(ground,sky,smoothstep(-0.02,0.02,normalize(way).y))),1.0);
}`,y=class{exposure=1;#t=[];#r=0;#e=!0;#a=null;#i=null;#o=new WeakMap;constructor(e,r){this.row=e,this.probes=r.map(({probe:o})=>{let{white:t,mean:i,centre:c,low:h,high:n}=o??{};return[t,i,...[c,h,n].flat()].every(Number.isFinite)?o:void 0})}sources([e,r],o=!1){if(!r.includes("painted"))return[e,r];let t=r.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/,"display(sampled.rgb)");return[e.replace(/void main\(\) ?{/,N(o)).replace(/painted ?= ?paint\.rgb/,"painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),t.replace("void main",I(this.row,o)).replace(/if ?\(shown\.a/,`${o?z:""}$&`).replace(/glow ?= ?0\.25/,"glow = white > 0.0 ? 1.0 : 0.7")]}illuminate(e){e.light=this,e.gl.deleteProgram(e.surface.program),e.surface=e.compile("surface")}adapt({cell:e,client:{known:r},index:{cells:o},memory:{fades:t},picture:i},c,h){let{exposure:n,row:{tone:m}}=this,s=e<0||m==="plain"?n:o[e].exposure??1;this.#e||=!(Math.hypot(...c.map((v,f)=>v-this.#t[f]))<1);let l=this.#e||!t?1:(n/s)**Math.exp((this.#r-h)/.2);this.exposure=Math.abs(Math.log(l))<.01?s:s*l,this.#e&&=!r[e],this.#r=h,this.#t=[...c],this.exposure!==n&&i.touch()}mirrorOf(e,{probe:r}){return!this.probes[r]||this.row.tone==="plain"?null:this.#i??=e.compile("mirror",void 0,!0)}paint({gl:e,memory:r,means:o},t,i,c){let{white:h,light:n,probe:m,extras:s}=i,{exposure:l,probes:{[m]:v}}=this;e.uniform1f(t.white,h*l);let f=(u,p,g,T,x)=>{let d=u<0?null:r.of(u),w=d&&d.levels>=p;if(e.uniform3fv(t[g],w?[-1,-1,-1]:o[u]??[1,1,1]),!w)return!1;e.activeTexture(e.TEXTURE0+x);let k=d.bind(!0,!0,p?1/0:c);return p&&e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MIN_FILTER,e.LINEAR),e.activeTexture(e.TEXTURE0),e.uniform1i(t[T],x),k};if(v&&t.polish){let u=this.#o.get(i);if(!u){let{metallicFactor:p=0,roughnessFactor:g=1}=JSON.parse(s);this.#o.set(i,u=[p,g])}e.uniform2fv(t.polish,u),e.uniform2f(t.power,v.white*l,Math.max(v.mean*l,1e-30));for(let p of["centre","low","high"])e.uniform3fv(t[p],v[p]);f(m,r.rows[m].sizes.length,"haze","probe",3)}return f(n,0,"code","lightmap",1)}surround(e,{turn:r,lens:o}){let{gl:t}=e,{row:{tone:i,sky:c=[],ground:h=[]},exposure:n}=this;if(i==="plain")return;let{program:m,at:s}=this.#a??=e.compile("surroundings",[$,M(i)]);t.useProgram(m),t.uniformMatrix3fv(s.turn,!1,r),t.uniform4fv(s.lens,o),t.uniform3fv(s.sky,c.map(l=>l*n)),t.uniform3fv(s.ground,h.map(l=>l*n)),t.bindVertexArray(null),t.depthFunc(t.LEQUAL),t.drawArrays(t.TRIANGLES,0,3),t.depthFunc(t.LESS)}};function R({comparison:a,index:e,picture:{renderer:r}}){if(!e.light)return;let o=new y(e.light,e.textures);o.illuminate(r),a&&o.illuminate(a.renderer)}export{y as Light,R as show};
